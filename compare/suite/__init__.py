"""The public suite: what a thin strip does, as data that any simulator can be held against.

A case (`compare.suite.case`) is physics, questions and references with intervals; a runner (`compare.suite.runners`)
answers; a score (`compare.suite.score`) says what came of every answer. One file adds a case, one file a runner
(docs/suite.md).
"""
