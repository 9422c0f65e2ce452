"""memscal: calibration of stress sensors under an elastic film, and what they measure.

``__init__.pyi`` lists the public names; each is loaded when it is first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
