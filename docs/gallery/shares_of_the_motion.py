"""The shares tr(Υ(k)M(k)) of the bodies add up to the number of coordinates: who has the degrees of freedom of a humanoid."""

import pycraft as pc

pc.robots.g1().dof_shares().plot(shadow=False)
