"""The catalogue of hard cases: mechanisms that lose digits, each with bounds on the error of every form and precision."""
