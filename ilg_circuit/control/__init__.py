"""Position control of a strip: a tuned feedback loop, the voltage for a path, the closed loop as a circuit.

In: an `Actuator`, with the covariance of its fit if it has one, and what is asked for. Out: results. May import:
`simulation` and what is below it.

    plant.py      voltage -> displacement as a small state space, nominal and for samples of the covariance
    laws.py       PI, PID, LQG, ADRC: each one linear law with anti-windup
    margins.py    margins of a loop, over all samples
    loop.py       the loop with its voltage limit and sensor delay over time, exact between events
    bound.py      the shortest time in which any voltage within the limit settles
    search.py     the law that is best among many;      tune.py   the request and its answer
    programme.py  the voltage nearest to a path, a convex programme;   track.py  the path and its answer
    track_shape.py  the voltages of segments for a path of the shape;   tracked_shape.py  its answer
    learn.py      the voltage for a path over repeated trials, and how fast their error falls
    sampled.py    a sampled controller within the transient, in either engine;   behavioural.py  a law in the circuit
    drift.py      a strip that changes while it runs;   adaptive.py   a PI that identifies it and follows
    op_amps.py    a PI of operational amplifiers with its parts list
    close.py      the loop and its answer;       export.py       python-control, C
"""
