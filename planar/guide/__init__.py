"""The guide: pages in Markdown that come along, as texts for a terminal and as a site."""
