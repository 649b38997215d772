from .document import TEMPLATE as TEMPLATE
from .rig_commands import ENVIRONMENT as ENVIRONMENT
from .rig_commands import QUESTION as QUESTION
