from .contact_loop import ContactGains as ContactGains
from .contact_loop import ContactLoop as ContactLoop
from .contact_loop import contact_decays as contact_decays
from .gains import HybridGains as HybridGains
from .gains import approach_speed as approach_speed
from .gains import choose_gains as choose_gains
from .gains import contact_gains as contact_gains
from .gains import friction_rates as friction_rates
from .path_file import read_path as read_path
from .settings import REQUEST_FIRST as REQUEST_FIRST

__all__ = [
    "ContactGains",
    "ContactLoop",
    "HybridGains",
    "approach_speed",
    "choose_gains",
    "contact_decays",
    "contact_gains",
    "friction_rates",
]
