"""The lane engine that simulated robots share: trials side by side, each lane loaded anew as soon as its trial ends.

`maths` and `noise` are the elementary functions, `neurons` is SCEANN-Q10 over lanes, `lanes` is the loop, `engine`
runs batches of trials on all cores, and `gap` makes a simulated body as imperfect as a real one.
"""
