"""`ribbonbench live`: a strip in the hand, on a page of this machine: sliders, a server, the page."""
