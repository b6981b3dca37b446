"""The hard cases, one module a group."""
