"""Parts of strips that are alike about axes: what their ends hold."""
