"""The view: what rig and twin said last, as a page that a browser draws live."""
