"""A strip as one page for a browser: sliders, drives and pictures, solved by ngspice in the page itself.

In: an `Actuator` and a drive. Out: the text of one HTML file. May import: `simulation` and what is below it.

    assets.py      what npm fetched: ngspice as WebAssembly, uPlot, their licences
    sliders.py     what can be moved, from the parameters of the strip's subcircuit
    page.py        the page, with native results that it compares itself with
    deck.js        parameters and drive -> SPICE deck;          measured.js   a CSV file -> columns, or what is wrong
    engine.js      runs decks, in a worker;                     solver.js     the page's side of it: latest wish first
    results.js     its answers -> curves, and the agreement;    plots.js      pictures
    main.js        sliders, messages, files, and what calls what
"""
