"""Numbers in the running text of the pages, from the results files alone.

A page has the marker ``<!-- =NAME -->`` right behind a number: ``off by 0.17<!-- =approach --> %``. What NAME is, and
which words of the page rest on results, is in the module of that page here; :mod:`studies.quoted.pages`
has the list.
"""
