"""The results for readers: terminal, CSV, Markdown, LaTeX, and one HTML page that needs no network.

Reading order: ``columns`` (what the tables hold), ``terminal``, ``exports``, ``sentences`` (what
may be claimed), ``animation``, ``figures``, ``page``.
"""
