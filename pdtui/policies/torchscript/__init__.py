"""TorchScript archives, read as data: nothing is unpickled, and TorchScript's own interpreter is not used.

PyTorch warns that `torch.jit.load` can be made to run code from a file. Therefore the archive is read in a
process of its own (`pdtui.policies.foreign`), opcode by opcode, and nothing that it names is called.
`torchscript_program` interprets its source code, calling only the operators listed in
`torchscript_operators`. Since that code runs in every control step, in this process, `forward_pass_budget`
limits what one pass may take.
"""

from pdtui.policies.torchscript.forward_pass_budget import ForwardPassLimitError
from pdtui.policies.torchscript.torchscript_archive import build_torchscript

__all__ = ["ForwardPassLimitError", "build_torchscript"]
