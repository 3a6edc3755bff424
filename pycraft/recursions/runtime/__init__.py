"""What written programs bring along, as sources of their own: functions in Python and the same in C++, a file for each topic.

`copied_parts` copies from the files what a program calls, with what that calls in turn. Nothing here knows of plans or of the package: the
Python needs NumPy alone, the C++ Eigen alone, and a file imports or includes no more than its neighbours.
"""
