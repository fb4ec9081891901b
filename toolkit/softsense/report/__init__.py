"""Reports: one self-contained HTML file each, pictures first, and the pictures as SVG beside it."""

from softsense.report.page import Figure, Table, write_page

__all__ = ["Figure", "Table", "write_page"]
