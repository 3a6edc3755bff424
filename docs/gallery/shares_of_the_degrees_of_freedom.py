"""The shares tr(Υ(k)M(k)) of a humanoid's bodies in its degrees of freedom, which add up to the number of coordinates."""

import pycraft as pc

pc.robots.g1().dof_shares().plot(shadow=False)
