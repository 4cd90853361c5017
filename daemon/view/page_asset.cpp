#include "daemon/view/page_asset.hpp"

#include <algorithm>
#include <array>

// Written by daemon/view/page/embed.cmake when splid is built.
extern const unsigned char splid_page_index[];
extern const std::size_t splid_page_index_size;
extern const unsigned char splid_page_view_js[];
extern const std::size_t splid_page_view_js_size;
extern const unsigned char splid_page_photons_js[];
extern const std::size_t splid_page_photons_js_size;
extern const unsigned char splid_page_field_js[];
extern const std::size_t splid_page_field_js_size;
extern const unsigned char splid_page_view_css[];
extern const std::size_t splid_page_view_css_size;
extern const unsigned char splid_page_numbers_js[];
extern const std::size_t splid_page_numbers_js_size;
extern const unsigned char splid_page_charts_js[];
extern const std::size_t splid_page_charts_js_size;
extern const unsigned char splid_page_icon[];
extern const std::size_t splid_page_icon_size;

namespace splid::view {
namespace {

constexpr const char* script = "text/javascript; charset=utf-8";
constexpr const char* style = "text/css; charset=utf-8";

}  // namespace

const PageAsset* find_asset(std::string_view path) {
  static const std::array<PageAsset, 8> assets{{
      {"", "text/html; charset=utf-8", splid_page_index, splid_page_index_size},
      {"view.js", script, splid_page_view_js, splid_page_view_js_size},
      {"photons.js", script, splid_page_photons_js, splid_page_photons_js_size},
      {"field.js", script, splid_page_field_js, splid_page_field_js_size},
      {"view.css", style, splid_page_view_css, splid_page_view_css_size},
      {"numbers.js", script, splid_page_numbers_js, splid_page_numbers_js_size},
      {"charts.js", script, splid_page_charts_js, splid_page_charts_js_size},
      {"icon.svg", "image/svg+xml", splid_page_icon, splid_page_icon_size},
  }};
  const auto* found = std::find_if(assets.begin(), assets.end(),
                                   [&](const PageAsset& asset) { return asset.path == path; });
  return found == assets.end() ? nullptr : found;
}

}  // namespace splid::view
