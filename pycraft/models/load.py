from .multibody import Multibody
def load(path): raise NotImplementedError
