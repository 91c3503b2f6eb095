"""One file per command: its function `command` is registered under the name of the file."""
