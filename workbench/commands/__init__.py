"""One module a command, each with `command`; `workbench.cli` names them."""
