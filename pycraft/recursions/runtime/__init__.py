"""Functions copied into written programs, in Python and the same in C++, a file for each topic.

`copied_parts` copies the functions that a program calls, and the functions that these call. Nothing here knows of plans or the package: the
Python needs only NumPy, the C++ only Eigen, and a file imports or includes only its neighbours.
"""
