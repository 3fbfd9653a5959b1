"""What the reference says of the look-ahead extension, as ``hli.reference``."""

from __future__ import annotations

AHEAD = r"""
HLI_AHEAD
    `gpAhead[i]`: the look-ahead extension of a channel; not of the manual
version_r | | | version of the extension, 2
sizeof_r | bytes | | its size
answer | | CNC | what the last answer of `contour_lookahead` is, beside its elements
slot_rw | | both | of each slot: phase (`HLI_AHEAD_FREE` ..) in the low byte, above it
    the generation of the PLC
plan_enable_w | | | TRUE: the CNC shows its plan
state | | CNC | every cycle, under the seqlock of the channel
plan | | CNC | the plan of the coming motion, under a seqlock of its own
slot | | both | the queue
HLI_AHEAD_ANSWER
    an answer beside its elements
count | | CNC | elements that it holds
empty | | CNC | why it holds none: `HLI_AHEAD_EMPTY_*`
end | | CNC | what ends that which is known: `HLI_AHEAD_END_*`
mode | | CNC | 1 marked log, 2 contour
epoch | | CNC | the present epoch
tag | | CNC | as in the request
more | | CNC | TRUE: there are more elements in the range than fit
start_position | index or 0.1 um | CNC | as in the request
length | 0.1 um | CNC | as in the request
dist_prog_start | 0.1 um | CNC | where the path was
HLI_AHEAD_REQUEST
    a request of the queue
start_position | index or 0.1 um | PLC | from where on
length | 0.1 um | PLC | how far; 0 for the log
mode | | PLC | `HLI_AHEAD_MODE_LOG` or `HLI_AHEAD_MODE_CONTOUR`
flags | | PLC | sum of `HLI_AHEAD_BEYOND`, `_EVENTS`, `_DETAILS`
epoch | | PLC | epoch that start_position counts in; 0: the present one
tag | | PLC | any number; the answer bears it
HLI_AHEAD_SLOT
    a slot of the queue
request | | PLC | the PLC's from claiming to asking
answer | | CNC | how many, whether more, why none
block | | CNC | elements, as of the manual; with `HLI_AHEAD_EVENTS` functions and
    dwells too (types 16 to 20)
detail | | CNC | one for each of `block`, with `HLI_AHEAD_DETAILS`
HLI_AHEAD_DETAIL
    an element beside its block
flags | | CNC | sum of `HLI_AHEAD_RAPID` and of `HLI_AHEAD_HAS_*`: which members count
epoch | | CNC | the epoch that the block's start_position counts in
code | | CNC | M, H, T: number
value | | CNC | dwell s, S rev/min, additional value of M and H
way | 0.1 um | CNC | from the present place to its start, over epochs
feed | 1 um/s | CNC | as programmed; 0: rapid
driven_length | 0.1 um | CNC | of the driven path; differs under smoothing
speed_start | 1 um/s | CNC | planned path speed at its start
speed_end | 1 um/s | CNC | planned path speed at its end
time_start | us | CNC | motion time until its start is reached
time_end | us | CNC | motion time until its end is reached
start | 0.1 um | CNC | axis positions at its start
end | 0.1 um | CNC | axis positions at its end
direction_start | | CNC | direction of the main axes at its start, a unit vector
direction_end | | CNC | direction of the main axes at its end
HLI_AHEAD_STATE
    of this cycle
motion_time | us | CNC | motion time; stands while the path waits for the PLC
epoch | | CNC | the present epoch
edition | | CNC | changes with the plan
plan_valid | | CNC | TRUE: the plan holds
speed | mm/s | CNC | path speed as interpolated
position | mm, degrees | CNC | of the channel's axes as interpolated, not rounded to 0.1 um
HLI_AHEAD_PLAN
    the plan of the coming motion
seq | | CNC | seqlock; odd while the CNC writes
edition | | CNC | changes with the plan
count | | CNC | knots
complete | | CNC | TRUE: at its end the path rests
override | | CNC | that it was made with; 1 is 100 %
knot | | CNC | places in time; between two of them the distance is a cubic of the time
HLI_AHEAD_KNOT
    a place in time
motion_time | us | CNC | as `state.motion_time`
distance | 0.1 um | CNC | runs on over epochs; only differences mean something
rate | 0.1 um/s | CNC | change of the distance
speed | 1 um/s | CNC | of the driven path
"""
