// The theme's arrows beside the pages of a section have no name for those who hear a page.
document.querySelectorAll(".bd-sidebar summary").forEach((arrow) => {
  arrow.setAttribute("aria-label", `Pages below ${arrow.closest("li").querySelector("a").textContent}`);
});

// The corner of a table, above names of rows and beside names of columns, is no heading.
document.querySelectorAll("th").forEach((cell) => {
  if (!cell.textContent.trim()) cell.setAttribute("role", "presentation");
});
