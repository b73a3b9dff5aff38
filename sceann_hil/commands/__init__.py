"""The commands of `sceann`: thin functions that parse, call the library and print.

`prepare`: list, schema, plan. `evolve`: evolve, resume. `inspect`: status, replay, export-csv. `observe`: view, record.
`study`, `landscape` (enumerate), `report`, `champion`: many runs.
`rehearse`; `gap`: compare, repeat, drift.
`firmware`: export, flash, verify.
"""
