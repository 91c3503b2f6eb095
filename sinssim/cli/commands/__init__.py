"""One file a command: its function `command` is registered under the file's name."""
