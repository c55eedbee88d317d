#include "model/inspect/page.h"

#include <fmt/format.h>

#include <algorithm>

#include "model/train/html.h"

namespace degas {
namespace {

using nlohmann::json;

json optional_number(const std::optional<double>& value) {
  return value ? json(*value) : json();
}

/// Where the head lies in the atlas: parts of its side from the left and from the top.
json face_region_json(const Inspection& inspection) {
  const std::optional<FaceRegion>& region = inspection.face_region;
  if (!region) return {};
  constexpr double grid = FaceRegion::grid;
  return {{"left", region->column / grid}, {"top", region->row / grid}, {"head_share", region->head_share}};
}

std::string number_text(const std::optional<double>& value, int decimals) {
  return value ? fmt::format("{:.{}f}", *value, decimals) : std::string("&ndash;");
}

std::string list_of(const std::string& heading, const std::vector<std::string>& lines) {
  if (lines.empty()) return "";
  std::string html = fmt::format("<h2>{}</h2><ul>", heading);
  for (const std::string& line : lines) html += "<li>" + escape(line) + "</li>";
  return html + "</ul>";
}

std::string camera_table(const Inspection& inspection) {
  std::string html =
      "<h2>Cameras</h2><table><tr><th>camera</th><th>size</th><th>focal lengths</th><th>principal point</th>"
      "<th>pictures</th><th>lacking</th><th>face codes</th><th>mean overlap</th><th>from the front</th>"
      "<th>among the four most frontal</th></tr>";
  for (const CameraFindings& found : inspection.cameras) {
    const Camera& c = found.camera;
    html += fmt::format(
        "<tr><td>{}</td><td>{} x {}</td><td>{:.1f}, {:.1f}</td><td>{:.1f}, {:.1f}</td><td>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td><td>{}</td><td>{}</td></tr>",
        escape(found.name), c.width, c.height, c.fx, c.fy, c.cx, c.cy, found.pictures, found.gaps, found.codes,
        number_text(found.mask_iou, 3),
        found.frontal_degrees ? number_text(found.frontal_degrees, 0) + "&deg;" : "&ndash;",
        found.frontal_degrees ? fmt::format("{} of {}", found.times_frontal, inspection.frames_seen.size())
                              : "&ndash;");
  }
  return html + "</table>";
}

/// Green where body and person cover each other, red where not.
std::string overlap_table(const Inspection& inspection) {
  if (inspection.overlaps.empty()) return "";
  std::string html =
      "<h2>Overlap of the body's silhouette with the mask</h2><p>Intersection over union. Clothes and hair are not in "
      "the "
      "body model: 0.8 to 0.9 is what a good fit has.</p><table><tr><th>frame</th>";
  for (const int frame : inspection.frames_seen) html += fmt::format("<th>{}</th>", frame);
  html += "</tr>";
  for (const int camera : inspection.cameras_seen) {
    html += fmt::format("<tr><td>{}</td>", escape(inspection.cameras[static_cast<size_t>(camera)].name));
    for (const int frame : inspection.frames_seen) {
      const auto found = inspection.overlaps.find({frame, camera});
      if (found == inspection.overlaps.end()) {
        html += "<td>&ndash;</td>";
        continue;
      }
      const double hue = std::clamp(240 * (found->second - 0.4), 0.0, 120.0);
      html += fmt::format("<td style=\"background:hsl({:.0f},60%,85%)\">{:.2f}</td>", hue, found->second);
    }
    html += "</tr>";
  }
  return html + "</table>";
}

std::string trial_table(const Inspection& inspection) {
  if (!inspection.diagnosis) return "";
  std::string html = fmt::format(
      "<h2>What if it were read otherwise?</h2><p>As read, small pictures overlap by {:.3f} in the mean. What would "
      "raise "
      "that much is probably wrong.</p><table><tr><th>if this were undone</th><th>mean overlap</th><th></th></tr>",
      inspection.diagnosis->mask_iou);
  for (const Diagnosis::Trial& trial : inspection.diagnosis->trials) {
    html += fmt::format("<tr><td>{}</td><td>{:.3f}</td><td style=\"text-align:left\">{}</td></tr>", escape(trial.name),
                        trial.mask_iou, escape(trial.words));
  }
  return html + "</table>";
}

std::string pictures(const std::string& heading, const std::vector<PagePicture>& list) {
  if (list.empty()) return "";
  std::string html = heading + "<div class=\"charts\">";
  for (const PagePicture& picture : list) html += figure(picture.jpeg, "jpeg", picture.caption);
  return html + "</div>";
}

}  // namespace

json inspection_json(const Inspection& inspection) {
  json cameras = json::array(), trials = json::array();
  for (const CameraFindings& found : inspection.cameras) {
    const Camera& c = found.camera;
    cameras.push_back({{"name", found.name},
                       {"width", c.width},
                       {"height", c.height},
                       {"fx", c.fx},
                       {"fy", c.fy},
                       {"cx", c.cx},
                       {"cy", c.cy},
                       {"center", {c.center().x(), c.center().y(), c.center().z()}},
                       {"pictures", found.pictures},
                       {"frames_lacking", found.gaps},
                       {"face_codes", found.codes},
                       {"mask_iou", optional_number(found.mask_iou)},
                       {"frontal_degrees", optional_number(found.frontal_degrees)}});
  }
  std::vector<std::string> suspected;
  if (inspection.diagnosis) {
    suspected = inspection.diagnosis->suspected;
    for (const Diagnosis::Trial& trial : inspection.diagnosis->trials) {
      trials.push_back({{"name", trial.name}, {"mask_iou", trial.mask_iou}, {"words", trial.words}});
    }
  }
  return {{"frames", inspection.frame_count},
          {"cameras", cameras},
          {"face_code_size", inspection.code_size},
          {"has_body_parameters", inspection.has_poses},
          {"has_masks", inspection.has_masks},
          {"frames_looked_at", inspection.frames_seen},
          {"mask_iou_mean", optional_number(inspection.mask_iou_mean)},
          {"mask_iou_min", optional_number(inspection.mask_iou_min)},
          {"reprojection_rms_px", json()},  // no format read here has 2-D keypoints
          {"face_region", face_region_json(inspection)},
          {"suspected", suspected},
          {"trials", trials},
          {"notes", inspection.notes},
          {"warnings", inspection.warnings}};
}

std::string inspection_page(const Inspection& inspection, const std::string& title) {
  std::string html = page_head(title);
  html += list_of(inspection.warnings.empty() ? "" : "Warnings", inspection.warnings);
  if (inspection.warnings.empty()) html += "<p><b>Nothing seems wrong.</b></p>";
  html += list_of("What cannot be told", inspection.notes);
  html += camera_table(inspection);
  html +=
      pictures(inspection.has_body ? "<h2>Body over photographs</h2><p>Blue: the registered body. Orange: the border "
                                     "of the mask.</p>"
                                   : "<h2>Pictures</h2>",
               inspection.overlays);
  html += overlap_table(inspection) + trial_table(inspection);
  html += "<h2>Plan of the cameras</h2>" + inspection.plan_svg;
  if (!inspection.atlas_png.empty()) {
    html += "<h2>UV atlas</h2>" +
            figure(inspection.atlas_png, "png",
                   fmt::format("Orange: the head, {:.0f} % of it in the network's region for the face "
                               "(framed).",
                               100 * inspection.face_region->head_share));
  }
  html += pictures("<h2>Faces, the most frontal first</h2>", inspection.face_rows);
  return html + "</body></html>\n";
}

std::string inspection_text(const Inspection& inspection) {
  std::string text = fmt::format(
      "{} frames, {} cameras, {}, {}, {}\n", inspection.frame_count, inspection.cameras.size(),
      inspection.has_poses ? "body parameters" : "no body parameters", inspection.has_masks ? "masks" : "no masks",
      inspection.code_size > 0 ? fmt::format("face codes of {} numbers", inspection.code_size)
                               : std::string("no face codes"));
  text += fmt::format("{:<12} {:>11} {:>9} {:>6} {:>8} {:>8}  {}\n", "camera", "size", "pictures", "codes", "overlap",
                      "frontal", "lacking");
  for (const CameraFindings& found : inspection.cameras) {
    const std::string overlap = found.mask_iou ? fmt::format("{:.3f}", *found.mask_iou) : "-";
    const std::string frontal = found.frontal_degrees ? fmt::format("{:.0f} deg", *found.frontal_degrees) : "-";
    text += fmt::format("{:<12} {:>11} {:>9} {:>6} {:>8} {:>8}  {}\n", found.name,
                        fmt::format("{}x{}", found.camera.width, found.camera.height), found.pictures, found.codes,
                        overlap, frontal, found.gaps);
  }
  if (inspection.mask_iou_mean) {
    text += fmt::format("overlap of body and mask: {:.3f} in the mean, {:.3f} at least, over {} pictures\n",
                        *inspection.mask_iou_mean, *inspection.mask_iou_min, inspection.overlaps.size());
  }
  for (const std::string& note : inspection.notes) text += "note: " + note + "\n";
  for (const std::string& warning : inspection.warnings) text += "warning: " + warning + "\n";
  if (inspection.warnings.empty()) text += "nothing seems wrong\n";
  return text;
}

}  // namespace degas
