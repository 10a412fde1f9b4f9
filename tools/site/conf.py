"""Sphinx's configuration of the site. It loads nothing from a server."""

import sys
from pathlib import Path

import robsim as rs

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

project = "RobSim"
author = "the RobSim authors"
project_copyright = "the RobSim authors"
version = release = rs.__version__
language = "en"

extensions = ["myst_parser", "sphinx_copybutton", "mathml", "reference_links", "table_headers"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4  # the anchors of code hosts
html_math_renderer = "mathml"
copybutton_prompt_text = r">>> |\.\.\. "
copybutton_prompt_is_regexp = True

html_theme = "pydata_sphinx_theme"
html_title = f"RobSim {release}"
html_static_path = [str(HERE / "static")]
templates_path = [str(HERE / "templates")]
html_search_scorer = str(HERE / "static" / "scorer.js")
html_css_files = ["site.css", "cards.css"]
html_js_files = ["../../versions.js", "site.js"]
html_show_sourcelink = False
html_copy_source = False
html_use_index = False
html_sidebars = {"index": []}
html_context = {"default_mode": "auto"}  # light or dark, as the system
html_theme_options = {
    "logo": {"text": "RobSim"},
    "navbar_persistent": ["search-button"],
    "navbar_end": ["version-menu", "theme-switcher"],
    "navbar_align": "left",
    "header_links_before_dropdown": 6,
    "secondary_sidebar_items": ["page-toc"],
    "navigation_with_keys": False,
    "show_nav_level": 1,
    "navigation_depth": 3,
    "footer_start": ["copyright"],
    "footer_end": [],
    "article_header_start": ["breadcrumbs"],
}
