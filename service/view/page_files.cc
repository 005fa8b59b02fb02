// SPDX-License-Identifier: Apache-2.0
#include "page_files.h"

#include <string>

// PRESCENE_PAGE_FOLDER is where the page's sources are at build time.
#define PRESCENE_PAGE_FILE(symbol, file)                                                             \
  asm(".section .rodata\n" #symbol "Begin:\n.incbin \"" PRESCENE_PAGE_FOLDER "/" file "\"\n" #symbol \
      "End:\n.byte 0\n.previous\n");                                                                 \
  extern "C" const char symbol##Begin[], symbol##End[]

PRESCENE_PAGE_FILE(kPrescenePageIcon, "icon.svg");
PRESCENE_PAGE_FILE(kPrescenePageIndex, "index.html");
PRESCENE_PAGE_FILE(kPrescenePageStyle, "view.css");
PRESCENE_PAGE_FILE(kPrescenePageView, "view.js");
PRESCENE_PAGE_FILE(kPrescenePagePanels, "panels.js");
PRESCENE_PAGE_FILE(kPrescenePageBands, "bands.js");
PRESCENE_PAGE_FILE(kPrescenePageRecorded, "recorded.js");
PRESCENE_PAGE_FILE(kPrescenePageScene, "scene3d.js");
PRESCENE_PAGE_FILE(kPrescenePageDrawing, "drawing.js");

namespace prescene::service {

std::vector<interfaces::WebFile> page_files() {
  const std::string script = "text/javascript; charset=utf-8";
  return {{"/", "text/html; charset=utf-8", {kPrescenePageIndexBegin, kPrescenePageIndexEnd}},
          {"/icon.svg", "image/svg+xml", {kPrescenePageIconBegin, kPrescenePageIconEnd}},
          {"/view.css", "text/css; charset=utf-8", {kPrescenePageStyleBegin, kPrescenePageStyleEnd}},
          {"/view.js", script, {kPrescenePageViewBegin, kPrescenePageViewEnd}},
          {"/panels.js", script, {kPrescenePagePanelsBegin, kPrescenePagePanelsEnd}},
          {"/bands.js", script, {kPrescenePageBandsBegin, kPrescenePageBandsEnd}},
          {"/recorded.js", script, {kPrescenePageRecordedBegin, kPrescenePageRecordedEnd}},
          {"/scene3d.js", script, {kPrescenePageSceneBegin, kPrescenePageSceneEnd}},
          {"/drawing.js", script, {kPrescenePageDrawingBegin, kPrescenePageDrawingEnd}}};
}

}  // namespace prescene::service
