"""Controllers as programs for Aseba's virtual machine, the one in a Thymio II: written, compiled, measured."""
