"""C++ parts of compiled source: the code before the lines of a graph, and the loop over states after them."""
