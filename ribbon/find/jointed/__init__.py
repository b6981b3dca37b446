"""A round rod that touches itself on segments that follow the places of contact: joints stand where a force acts.

It is an interface in Python, which the page contact_lines uses; no key of a scene asks for it yet. Abscissae and
lengths of segments are over l, forces are in D w / l^2.
"""
