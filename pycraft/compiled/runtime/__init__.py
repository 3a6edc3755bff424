"""C++ that compiled source is made of: what stands before the lines of a graph, and the loop over states behind them."""
