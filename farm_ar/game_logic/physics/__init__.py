"""The physics of the tabletop: buildings that slide on a plane, and the hand that moves them."""
