// A page that was opened as a file may not read other files: the search then lists titles without excerpts, and asks for none.
if (location.protocol === "file:" && typeof DOCUMENTATION_OPTIONS !== "undefined") DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = false;
