"""The paper's tables, figures and claims from the studies in a folder.

`write_report` (`build`) puts the sections together: `pole`, `goal`, `beyond` (landscapes, robustness), `sensitivity`.
`cells` reads studies, `claims`, `pole_claims` and `goal_claims` say what is compared, `statistics` how; `panels`,
`network`, `behaviour` and `more_figures` draw in the `style` of the house; `page` writes Markdown and HTML.
"""

from sceann_hil.study.report.build import write_report

__all__ = ["write_report"]
