"""Reports of recordings: what is computed, what is drawn, and the page.

Computations take plain arrays and know no recording: `periodic`, `spectrum`, `sweep`, `coil_load`,
`envelope`. `figures` makes charts of plain arrays; a `chart` is plain data, drawn by `picture` (PNG) or
`interactive` (browser). `signals` and `subject` read recordings, `sections` and `run_sections` say what is
to be seen in them, `report` puts all together and `page` writes it.

    from mount_bags.report import figures, picture

    chart = figures.hysteresis_loops([figures.Named('2000 Ns/m', displacement, force)], [])
    picture.draw_chart(chart, Path('loss.png'))
"""
