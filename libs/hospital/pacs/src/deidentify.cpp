#include "osteo/hospital/pacs/deidentify.h"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>

#include "association.h"
#include "deidentify_table.h"
#include "node.h"
#include "node_tables.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/shell.h"
#include "telling.h"

namespace osteo::inline hospital {
namespace {

using pacs::DeidAction;
using Key = std::array<unsigned char, crypto_generichash_KEYBYTES>;

const DcmTagKey kTelephones[] = {DCM_PatientTelephoneNumbers, DCM_ReferringPhysicianTelephoneNumbers,
                                 DCM_PersonTelephoneNumbers, DCM_OrderCallbackPhoneNumber};

Key key_of(const fs::path& file) {
  if (::sodium_init() < 0)
    throw Error(ExitCode::failed, "there is no randomness for a key", "libsodium cannot be used on this machine");
  Key key{};
  if (file.empty()) {
    ::randombytes_buf(key.data(), key.size());
    return key;
  }
  constexpr const char* kHow = "make one: (umask 077; head -c 32 /dev/urandom > deidentify.key), and keep it";
  require_readable(file);
  struct stat facts {};
  if (::stat(file.c_str(), &facts) != 0 || !S_ISREG(facts.st_mode))
    throw Error(ExitCode::usage, "the key '" + file.string() + "' is no file", kHow);
  if ((facts.st_mode & 077) != 0)
    throw Error(ExitCode::usage, "others may read the key '" + file.string() + "'", "chmod 600 " + shell_path(file));
  if (facts.st_size < 32 || facts.st_size > 4096)
    throw Error(ExitCode::usage,
                "the key '" + file.string() + "' has " + std::to_string(facts.st_size) + " bytes, not 32 to 4096",
                kHow);
  const auto bytes = read_file(file);
  ::crypto_generichash(key.data(), key.size(), reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(),
                       nullptr, 0);
  return key;
}

std::array<unsigned char, 16> keyed(const Key& key, char kind, std::string_view text) {
  const std::string all = kind + std::string(text);
  std::array<unsigned char, 16> hash{};
  ::crypto_generichash(hash.data(), hash.size(), reinterpret_cast<const unsigned char*>(all.data()), all.size(),
                       key.data(), key.size());
  return hash;
}

// A UUID as a decimal number below 2.25 (PS3.5 B.2), its version "8, as the maker likes" (RFC 9562).
std::string new_uid(const Key& key, const std::string& uid) {
  auto hash = keyed(key, 'u', uid);
  hash[6] = static_cast<unsigned char>((hash[6] & 0x0FU) | 0x80U);
  hash[8] = static_cast<unsigned char>((hash[8] & 0x3FU) | 0x80U);
  std::string digits;
  while (std::ranges::any_of(hash, [](unsigned char c) { return c != 0; })) {
    unsigned rest = 0;
    for (unsigned char& c : hash) {
      rest = rest * 256 + c;
      c = static_cast<unsigned char>(rest / 10);
      rest %= 10;
    }
    digits += static_cast<char>('0' + rest);
  }
  std::ranges::reverse(digits);
  return "2.25." + digits;
}

std::string code_of(const Key& key, DcmItem& data) {
  std::string who = pacs::text_of(data, DCM_PatientID);
  // Who has no number is distinguished by the study, so that no two persons become one.
  who = who.empty() ? "s" + pacs::text_of(data, DCM_StudyInstanceUID)
                    : "p" + pacs::text_of(data, DCM_IssuerOfPatientID) + '\n' + who;
  const auto hash = keyed(key, 'c', who);
  constexpr std::string_view kHex = "0123456789ABCDEF";
  std::string code = "CASE-";
  for (std::size_t n = 0; n < 8; ++n) (code += kHex[hash[n] >> 4U]) += kHex[hash[n] & 15U];
  return code;
}

std::uint32_t number_of(const DcmTagKey& tag) {
  return static_cast<std::uint32_t>(tag.getGroup()) << 16U | tag.getElement();
}

const DeidAction* action_of(const DcmTagKey& tag) {
  const auto row = std::ranges::lower_bound(pacs::kDeidTable, number_of(tag), {}, &pacs::DeidRow::tag);
  return row != pacs::kDeidTable.end() && row->tag == number_of(tag) ? &row->action : nullptr;
}

std::string replaced_uids(const Key& key, const std::string& values) {
  std::string all;
  for (std::size_t at = 0; at <= values.size();) {
    const std::size_t end = std::min(values.find('\\', at), values.size());
    const std::string uid = values.substr(at, end - at);
    if (at != 0) all += '\\';
    // Classes, syntaxes and frames that the standard itself names belong to nobody.
    all += uid.empty() || ::dcmFindNameOfUID(uid.c_str()) != nullptr ? uid : new_uid(key, uid);
    at = end + 1;
  }
  return all;
}

// Which class an object is of belongs to nobody, also where the standard named it after this DCMTK was made.
bool names_class(const DcmTagKey& tag, const std::string& uid) {
  return (tag == DCM_SOPClassUID || tag == DCM_ReferencedSOPClassUID) && uid.starts_with("1.2.840.10008.");
}

std::string value_of(DcmElement& e) {
  OFString text;
  if (e.getOFStringArray(text).bad()) return {};
  std::string value(text.c_str(), text.size());
  while (!value.empty() && (value.back() == ' ' || value.back() == '\0')) value.pop_back();
  return value;
}

void put(DcmElement& e, const std::string& value) {
  if (e.putOFStringArray(OFString(value.data(), value.size())).bad())
    throw Error(ExitCode::corrupt, "attribute " + std::string(e.getTag().toString().c_str()) + " cannot be replaced");
}

// A value that means nothing and is valid for the kind of the attribute.
void put_dummy(DcmElement& e) {
  switch (e.ident()) {
    case EVR_DA:
      return put(e, "19000101");
    case EVR_DT:
      return put(e, "19000101000000");
    case EVR_TM:
      return put(e, "000000");
    case EVR_AS:
      return put(e, "000Y");
    case EVR_UR:
      return put(e, "about:blank");
    case EVR_AT:
      return put(e, "(0000,0000)");
    case EVR_PN:
    case EVR_LO:
    case EVR_SH:
    case EVR_ST:
    case EVR_LT:
    case EVR_UT:
    case EVR_UC:
    case EVR_CS:
    case EVR_AE:
      return put(e, "REMOVED");
    case EVR_OB: {
      const std::array<Uint8, 2> none{};
      if (e.putUint8Array(none.data(), none.size()).bad()) break;
      return;
    }
    case EVR_OW: {
      const std::array<Uint16, 1> none{};
      if (e.putUint16Array(none.data(), none.size()).bad()) break;
      return;
    }
    default:
      return put(e, "0");
  }
  throw Error(ExitCode::corrupt, "attribute " + std::string(e.getTag().toString().c_str()) + " cannot be replaced");
}

class Cleaner {
 public:
  explicit Cleaner(const Key& key) : key_(key) {}

  /// `dummies`: everything in it becomes a dummy, as in a sequence that must stay and may say nothing.
  void clean(DcmItem& item, bool dummies = false) const {
    std::vector<DcmElement*> gone;
    for (unsigned long n = 0; n < item.card(); ++n)
      if (!clean(*item.getElement(n), dummies)) gone.push_back(item.getElement(n));
    for (DcmElement* const e : gone) delete item.remove(e);
  }

 private:
  void each(DcmElement& sequence, bool dummies) const {
    auto& items = dynamic_cast<DcmSequenceOfItems&>(sequence);
    for (unsigned long n = 0; n < items.card(); ++n) clean(*items.getItem(n), dummies);
  }

  /// False: it has to go.
  bool clean(DcmElement& e, bool dummies) const {
    const DcmTagKey tag = e.getTag().getXTag();
    const unsigned group = tag.getGroup();
    if (group % 2 != 0 || (group & 0xFF00U) == 0x5000 || (group & 0xFF00U) == 0x6000) return false;
    const DeidAction* const action = action_of(tag);
    const bool empties = action != nullptr && (*action == DeidAction::Z || *action == DeidAction::XZ);
    // Nobody can tell what an attribute holds whose kind is not known, nor what would be a valid dummy for it.
    if (e.ident() == EVR_UN || e.ident() == EVR_UNKNOWN || e.ident() == EVR_UNKNOWN2B) {
      e.clear();
      return empties;
    }
    const bool sequence = e.ident() == EVR_SQ;
    if (action == nullptr || *action == DeidAction::U || *action == DeidAction::XZU) {
      if (sequence) {
        each(e, dummies);
      } else if (e.ident() == EVR_UI) {
        if (!names_class(tag, value_of(e))) put(e, replaced_uids(key_, value_of(e)));
      } else if (action != nullptr || dummies) {
        put_dummy(e);
      } else if (e.ident() == EVR_PN) {
        e.clear();
      }
      return true;
    }
    if (*action == DeidAction::X) return false;
    if (empties || (sequence && *action == DeidAction::XZD)) {
      e.clear();
    } else if (sequence) {
      each(e, true);
    } else if (e.ident() == EVR_UI) {
      put(e, replaced_uids(key_, value_of(e)));
    } else {
      put_dummy(e);
    }
    return true;
  }

  const Key& key_;
};

using Visit = std::function<void(DcmElement&)>;
void visit(DcmItem& item, const Visit& what) {
  for (unsigned long n = 0; n < item.card(); ++n) {
    DcmElement& e = *item.getElement(n);
    what(e);
    if (auto* const items = dynamic_cast<DcmSequenceOfItems*>(&e))
      if (e.ident() == EVR_SQ)
        for (unsigned long k = 0; k < items->card(); ++k) visit(*items->getItem(k), what);
  }
}

pacs::Telling notifying_of(DcmItem& data) {
  pacs::Telling notifying;
  visit(data, [&](DcmElement& e) {
    const DcmTagKey tag = e.getTag().getXTag();
    // What Osteotome 0.1 wrote for the creator of a segmentation is a program, and its manufacturer's name is kept.
    if (tag == DCM_ContentCreatorName && value_of(e) == "OSTEOTOME^") return;
    if (e.ident() == EVR_PN || tag == DCM_PatientID || tag == DCM_AccessionNumber || tag == DCM_RETIRED_OtherPatientIDs)
      notifying.add_name(value_of(e));
    else if (tag == DCM_PatientBirthDate)
      notifying.add_birth_date(value_of(e));
    else if (std::ranges::find(kTelephones, tag) != std::end(kTelephones))
      notifying.add_telephone(value_of(e));
  });
  return notifying;
}

bool is_text(DcmEVR kind) {
  constexpr DcmEVR kWords[] = {EVR_LO, EVR_SH, EVR_ST, EVR_LT, EVR_UT, EVR_UC, EVR_PN, EVR_AE, EVR_CS, EVR_UR};
  return std::ranges::find(kWords, kind) != std::end(kWords);
}

std::string why_not(DcmItem& data, const std::string& sop_class) {
  if (std::ranges::find(pacs::kDeidentified, sop_class, &pacs::UidRow::uid) == pacs::kDeidentified.end())
    return pacs::class_name(sop_class) + " may hold words that no table knows";
  if (pacs::text_of(data, DCM_BurnedInAnnotation) == "YES")
    return "words are burned into its pixels (BurnedInAnnotation is YES)";
  OFString type;
  data.findAndGetOFStringArray(DCM_ImageType, type);
  std::string plain;
  for (const char c : type)
    if (std::isalpha(static_cast<unsigned char>(c)) != 0) plain += c;
  if (plain.find("SCREENSAVE") != std::string::npos) return "it is a picture of a screen, with words burned in";
  return {};
}

void mark(DcmDataset& data, const std::string& code) {
  data.putAndInsertString(DCM_PatientName, code.c_str());
  data.putAndInsertString(DCM_PatientID, code.c_str());
  data.putAndInsertString(DCM_PatientIdentityRemoved, "YES");
  data.putAndInsertString(DCM_DeidentificationMethod, "Osteotome: PS3.15 2026c Annex E, Basic Profile");
  data.putAndInsertString(DCM_LongitudinalTemporalInformationModified, "REMOVED");
  data.findAndDeleteElement(DCM_DeidentificationMethodCodeSequence);
  DcmItem* method = nullptr;
  if (data.findOrCreateSequenceItem(DCM_DeidentificationMethodCodeSequence, method, 0).bad() || method == nullptr)
    throw Error(ExitCode::failed, "the method cannot be named");
  method->putAndInsertString(DCM_CodeValue, "113100");
  method->putAndInsertString(DCM_CodingSchemeDesignator, "DCM");
  method->putAndInsertString(DCM_CodeMeaning, "Basic Application Confidentiality Profile");
}

}  // namespace

DeidentifyReport deidentify_objects(const std::vector<DicomObject>& objects, const fs::path& out,
                                    const DeidentifyOptions& options, const Context& context) {
  pacs::quiet_dcmtk(1);
  const Key key = key_of(options.key);
  const Cleaner cleaner(key);
  DeidentifyReport report;
  std::map<std::pair<std::string, std::string>, DeidentifiedStudy> studies;
  for (std::size_t n = 0; n < objects.size(); ++n) {
    context.progress(static_cast<double>(n) / static_cast<double>(objects.size()), "taking out what identifies");
    const fs::path& file = objects[n].file;
    const auto refuse = [&](const std::string& why) { report.refused.push_back({file, why}); };
    DcmFileFormat read;
    if (read.loadFile(file.c_str()).bad()) {
      refuse("it is damaged");
      continue;
    }
    // Without the head of the file as it came: titles and names of programs in it, and what hides before it, stay
    // behind.
    DcmDataset& data = *read.getDataset();
    const std::string sop_class = pacs::text_of(data, DCM_SOPClassUID);
    if (const std::string why = why_not(data, sop_class); !why.empty()) {
      refuse(why);
      continue;
    }
    const pacs::Telling notifying = notifying_of(data);
    DeidentifiedStudy study{
        code_of(key, data), {}, pacs::text_of(data, DCM_PatientID), pacs::text_of(data, DCM_StudyInstanceUID)};
    for (char& c : study.patient_id)
      if (static_cast<unsigned char>(c) < 32 || static_cast<unsigned char>(c) > 126) c = '?';
    const E_TransferSyntax syntax = data.getOriginalXfer();
    try {
      cleaner.clean(data);
    } catch (const Error& e) {
      refuse(e.what());
      continue;
    }
    std::string left;
    visit(data, [&](DcmElement& e) {
      if (!left.empty() || !is_text(e.ident())) return;
      if (const std::string_view what = notifying.found_in(value_of(e)); !what.empty())
        left = std::string(e.getTag().toString().c_str()) + ", which is kept, has " + std::string(what);
    });
    if (!left.empty()) {
      refuse("attribute " + left);
      continue;
    }
    mark(data, study.code);
    const pacs::ObjectHead head{sop_class,
                                pacs::text_of(data, DCM_SOPInstanceUID),
                                pacs::text_of(data, DCM_StudyInstanceUID),
                                pacs::text_of(data, DCM_SeriesInstanceUID),
                                {}};
    if (!pacs::is_uid(head.sop_instance) || !pacs::is_uid(head.study) || !pacs::is_uid(head.series)) {
      refuse("its study, series or own UID is missing or none");
      continue;
    }
    const fs::path to = out / pacs::place_of(head);
    if (fs::exists(to)) {
      refuse("an object with its UID is there already");
      continue;
    }
    fs::create_directories(to.parent_path());
    DcmFileFormat fresh(&data, OFFalse);
    const OFCondition saved = fresh.saveFile(to.c_str(), syntax, EET_UndefinedLength, EGL_withoutGL, EPD_withoutPadding,
                                             0, 0, EWM_createNewMeta);
    static_cast<void>(fresh.getAndRemoveDataset());  // it is `read`'s
    pacs::ObjectHead written;
    if (saved.bad() || !pacs::read_head(to, written) || written.sop_instance != head.sop_instance)
      throw Error(ExitCode::cannot_write, "an object cannot be written: " + std::string(saved.text()),
                  "is the disk full?");
    study.study = head.study;
    studies.emplace(std::pair{study.code, study.study}, study);
    ++report.written;
  }
  for (const auto& [by, study] : studies) report.studies.push_back(study);
  return report;
}

void write_deidentify_map(const fs::path& file, const DeidentifyReport& report) {
  if (output_exists(file))
    throw Error(ExitCode::cannot_write, "'" + file.string() + "' exists already",
                "another name: a map is never replaced");
  Json studies = Json::list();
  for (const DeidentifiedStudy& s : report.studies)
    studies.push_back(
        {{"code", s.code}, {"patient_id", s.patient_id}, {"study", s.study}, {"original_study", s.original}});
  const std::string text = Json{{"osteotome_deidentified", 1}, {"studies", studies}}.dump(2) + "\n";
  write_atomically(file, [&](const fs::path& temporary) {
    // For nobody else from its first byte on.
    const int to = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    const bool good = to >= 0 && ::fchmod(to, 0600) == 0 &&
                      ::write(to, text.data(), text.size()) == static_cast<ssize_t>(text.size());
    if (to >= 0) ::close(to);
    if (!good) throw Error(ExitCode::cannot_write, "'" + file.string() + "' cannot be written");
  });
}

}  // namespace osteo::inline hospital
