"""The game in a browser: games on the server's clock, and the page that plays them."""
