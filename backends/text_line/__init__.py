"""A robot that answers questions in lines of text, described by configuration alone (``docs/robots/text-line.md``)."""

from backends.text_line.config import TextLineConfig
from backends.text_line.robot import TextLineRobot

__all__ = ["TextLineConfig", "TextLineRobot"]
