"""Where a band begins that is joined after half turns: an open strip whose end is turned, and a twisted circle."""
