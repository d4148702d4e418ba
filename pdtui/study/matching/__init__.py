"""The matching study: do the units that spectra match with an attribute move it?"""
