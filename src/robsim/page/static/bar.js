// The bar: undo, redo, save, share, film, copy.
