"""The colours of everything that is drawn: the same thing has the same colour in every picture and page."""

COLOURS = ('#1f5fa8', '#b03030', '#2f7d32', '#c77700', '#6a3d9a', '#0f8b8d')
"""Of lines in the order of a panel; chosen: far apart in lightness too, so that they differ on paper."""

LEVEL_COLOUR, SPAN_COLOUR = '#b03030', '#666666'

COLOUR_OF = {
    'displacement': '#1f5fa8',
    'hydro': '#2f7d32',
    'undamped': '#888888',
    'switched_viscous': '#c77700',
    'continuous_viscous': '#6a3d9a',
    'setpoint': '#c77700',
    'current': '#1f5fa8',
    'damping': '#1f5fa8',
    'desired_force': '#b03030',
    'latency': '#6a3d9a',
}
"""Of what has a name: mounts, policies and signals."""
