"""Policy Dissection: finds out which hidden units move what.

`pdtui.dissection.dissect` runs the method in the paper's order: monitor, transform, match and correlate
phases (section 3.2, in `pdtui.spectra`), then probe units and search for behaviors, which measures what a
stimulation does instead of inferring it (`pdtui.probing`, `pdtui.search`). The other modules turn the result
into a map, data and tables.
"""
