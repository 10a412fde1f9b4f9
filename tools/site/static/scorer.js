// Weights of the search: pages that cure an error come first, the list of changes last.
"use strict";
var Scorer = {
  score: ([page, , , , score]) => {
    if (page === "howto/errors" || page === "howto/outcomes") return score + 12;
    if (page === "CHANGELOG") return score - 10;
    return page.startsWith("begin/") || page.startsWith("howto/") ? score + 3 : score;
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
