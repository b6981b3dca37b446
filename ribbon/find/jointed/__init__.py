"""A round rod that touches itself on segments that follow the places of contact: joints stand where a force acts."""
