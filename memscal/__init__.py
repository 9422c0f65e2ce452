"""memscal: calibration of stress sensors under an elastic film, and what they measure.

``__init__.pyi`` lists the public names with their modules; each is loaded when it is first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__all__.remove("acquire")  # a module with names of its own
