"""The shearable, extensible rod (Antman, Simo, Reissner) on quaternion elements."""
