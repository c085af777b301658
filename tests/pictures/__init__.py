"""About 200 pictures of all pages, to be looked at: ``make pictures``.

Page, window, language, theme, robots and situation: each pair of values is on one
picture at least, and all pictures are on one sheet.  Nothing here passes or fails; what
a script can find wrong (overflow, a covered STOP, an error) is named beside it.
"""
