"""The workbench: a page of this machine that edits scenarios, starts commands and lists their results."""
