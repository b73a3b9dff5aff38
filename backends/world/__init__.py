"""A world with things in it: walls, obstacles, lamps and shades of the floor, and a robot that feels them."""
