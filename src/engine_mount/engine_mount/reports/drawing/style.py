"""The colours of everything that is drawn: the same thing has the same colour in every picture and page."""

COLOURS = ('#1f5fa8', '#c77700', '#6a3d9a', '#0f8b8d', '#8a4b2d', '#b5408f')
"""Of recordings and of lines without a colour of their own, in their order.

Chosen: far apart in lightness too, so that they differ on paper; none is that of a level, the hydromount or
an undamped mount.
"""

LEVEL_COLOUR, SPAN_COLOUR = '#b03030', '#666666'
UNDAMPED_COLOUR, HYDROMOUNT_COLOUR = '#888888', '#2f7d32'
DIFFERENCE_COLOUR = '#666666'
"""Of B - A, and of what is left between two lines that coincide."""

COLOUR_OF = {
    'displacement': '#1f5fa8',
    'friction': '#1f5fa8',
    'hydro': HYDROMOUNT_COLOUR,
    'friction_off': UNDAMPED_COLOUR,
    'elastomer': UNDAMPED_COLOUR,
    'undamped': UNDAMPED_COLOUR,
    'switched_viscous': '#c77700',
    'continuous_viscous': '#6a3d9a',
    'setpoint': '#c77700',
    'current': '#1f5fa8',
    'damping': '#1f5fa8',
    'desired_force': '#c77700',
    'latency': '#6a3d9a',
}
"""Of what has a name: mounts, policies and signals."""
