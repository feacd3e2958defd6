"""Compiled loops over data: tapes of registers and polynomial coefficients. Nothing here knows a formula."""
