"""Certificates: a value with its measured error, its condition, where digits are lost and what the next rung costs."""
