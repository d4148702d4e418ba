"""TorchScript archives as data: nothing is unpickled, and TorchScript's own interpreter never sees them.

PyTorch warns that `torch.jit.load` can be made to run anything that a file holds. So the archive is read
here: `pickled` reads the tree of objects opcode by opcode and calls nothing that it names, and `program`
walks the code that stands in the archive as text, calling the operators of a list (`operators`) and no
others.
"""

from pdtui.policies.torchscript.torchscript_archive import is_torchscript, read_torchscript

__all__ = ["is_torchscript", "read_torchscript"]
