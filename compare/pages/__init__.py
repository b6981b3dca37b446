"""What each command says: sentences, tables, `result.json` and `page.json`, one module a study."""
