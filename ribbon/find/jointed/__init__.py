"""A round rod that touches itself on segments that follow the places of contact: joints stand where a force acts.

A scene asks for it by `contact.joints = "follow"`; drawn curves begin in `drawn`. Abscissae and
lengths of segments are over l, forces are in D w / l^2.
"""
