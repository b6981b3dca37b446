"""The record: a result is declared once, and files, tables and the terminal are made from the declaration."""
