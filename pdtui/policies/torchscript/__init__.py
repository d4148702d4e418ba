"""TorchScript archives, read as data: nothing is unpickled, and TorchScript's own interpreter is not used.

PyTorch warns that `torch.jit.load` can be made to run code from a file. Therefore the archive is read here:
`pickle_reader` reads the tree of objects opcode by opcode and calls nothing that it names, and
`torchscript_program` interprets the archive's source code, calling only the operators listed in
`torchscript_operators`.
"""

from pdtui.policies.torchscript.torchscript_archive import is_torchscript, read_torchscript

__all__ = ["is_torchscript", "read_torchscript"]
