"""Time-optimal transport: reduced model, optimal control problem, plans, and tracking them.

Reading order: ``model`` (what moves how), ``limits`` (what a motion keeps to), ``problem`` (the
program, which CasADi's IPOPT solves), ``guesses`` and ``search`` (where it begins, and which of its
answers is taken), ``plan`` (what comes out), ``stored`` (what was found once, for readers without
CasADi), ``tracking`` (following a plan).
"""
