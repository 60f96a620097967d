"""The command ``defmanip certify``: the ladder of bounds for one object, attacked."""
