// Corrections by hand: read, and done on a small CT, they are rejected or leave a state that can be saved and undone.
#include <cstdlib>
#include <string_view>

#include "edit_subject.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/edit/edit_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace osteo;
  static const Image ct = test::walnut({20, 18, 16});
  static const Labels start = test::start_of(ct, 300);
  try {
    EditRecipe recipe = parse_edits(std::string_view(reinterpret_cast<const char*>(data), size), "edits.json");
    recipe.ct_hash = hash_of(ct);
    EditDocument document(ct, start);
    apply_edits(document, recipe);
    static_cast<void>(parse_edits(edits_text(recipe_of(document)), "again.json"));
    while (document.undo()) {
    }
    if (document.hash() != document.start_hash()) std::abort();
  } catch (const Error&) {
  }
  return 0;
}
