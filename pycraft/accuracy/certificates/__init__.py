"""Certificates: a value with its measured error, its condition, the places of lost digits, and the cost of the next rung."""
