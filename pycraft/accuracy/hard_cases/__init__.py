"""The catalogue of hard cases: mechanisms on which digits are lost, each with what every form and precision must keep of them."""
