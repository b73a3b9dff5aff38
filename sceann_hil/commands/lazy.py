"""A Typer group that imports a command's module when the command is called, and not before."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any

import typer
from typer.core import TyperGroup

from sceann_hil.commands import COMMANDS
from sceann_hil.errors import InterruptedNow, PluginError

PLUGIN_GROUP = "sceann_hil.commands"
"""Entry points of functions ``register(app)`` that add commands to a Typer app."""


class LazyCommands(TyperGroup):
    """The commands of `COMMANDS`, and of other packages: shown from the table, imported when called."""

    def list_commands(self, ctx: Any) -> list[str]:
        """All names: ours in the table's order, then those of other packages, which have to be imported for it."""
        return [*COMMANDS, *(name for name in self._plugged_in() if name not in COMMANDS)]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A command as the help needs it; ours without its options."""
        return super().get_command(ctx, cmd_name) or self._plugged_in(only=cmd_name).get(cmd_name)

    def invoke(self, ctx: Any) -> Any:
        """Run the command. Ctrl-C that it does not take for itself is our message and exit code, not the library's."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as stopped:
            raise InterruptedNow("Stopped, as asked (Ctrl-C).") from stopped

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that was called, whole."""
        if args and args[0] in COMMANDS:
            module = import_module(f"sceann_hil.commands.{COMMANDS[args[0]].module}")
            return args[0], _registered(module.register)[args[0]], args[1:]
        return super().resolve_command(ctx, args)

    def _plugged_in(self, only: str | None = None) -> dict[str, Any]:
        """Commands of other packages; all of them, or those of packages that may have the one that is looked for."""
        found: dict[str, Any] = {}
        broken: list[str] = []
        for entry in _entries(only):
            try:
                found |= _registered(entry.load())
            except Exception as error:
                package = f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an unknown package"
                broken.append(f"{package} ({entry.value}): {type(error).__name__}: {error}")
            if only in found:
                return found
        if broken and only is not None:
            raise PluginError(
                f"There is no command {only!r}, and commands of other packages cannot be loaded: {'; '.join(broken)}.",
                "Repair, update or uninstall these packages.",
            )
        for what in broken:
            typer.echo(f"Commands of another package cannot be loaded: {what}", err=True)
        return found


def add_placeholders(app: typer.Typer) -> None:
    """Names and summaries of our commands: all that the help prints."""
    for name, entry in COMMANDS.items():
        app.command(name, help=entry.summary, rich_help_panel=entry.topic.value)(_placeholder)


def _placeholder() -> None:
    raise AssertionError("a command is imported before it is called")


def _entries(first: str | None) -> Iterator[EntryPoint]:
    """The entry points, the one with the name of the command before the others."""
    yield from sorted(entry_points(group=PLUGIN_GROUP), key=lambda entry: (entry.name != first, entry.name))


def _registered(register: Callable[[typer.Typer], None]) -> dict[str, Any]:
    app = typer.Typer(rich_markup_mode="markdown", context_settings={"help_option_names": ["-h", "--help"]})
    register(app)
    return dict(typer.main.get_group(app).commands)
