"""Take the pictures of report and live page in docs/images, in headless Chromium.

After the README's `make demo` and `sysid diagnose ... --out out/mine`:
    python docs/screenshots.py --report out/mine/report.html
and, while a rig and a twin that move are shown by view_node:
    python docs/screenshots.py --page http://127.0.0.1:8077/
With view_node's parameters twin_file and recordings, a recording is made, pictured under its
diagnosis, and the diagnosis is given up.
"""

import argparse
import shutil
from pathlib import Path
from typing import Any

from PIL import Image, ImageOps
from playwright.sync_api import Browser, Page, sync_playwright

IMAGES = Path(__file__).parent / "images"
DESKTOP, PHONE = {"width": 1280, "height": 900}, {"width": 390, "height": 844}
REPORT = {  # name -> viewport, colours, and the part of the page at the top of the picture
    "report": (DESKTOP, "light", None),
    "report_windows": (DESKTOP, "light", "#recording"),
    "report_evidence": (DESKTOP, "light", "#residuals"),
    "report_dark": (DESKTOP, "dark", None),
    "report_phone": (PHONE, "light", None),
}
PAGE = {
    "page": (DESKTOP, "light"),
    "page_dark": (DESKTOP, "dark"),
    "page_phone": (PHONE, "light"),
}
NEWEST = "#recordings li:first-child"  # row of the recording that was made last
COLOURS = 128  # of a picture: a quarter of the size, and nobody sees it
RECORDED_MS = 12_000  # of a recording: long enough to be diagnosed for a while
DIAGNOSED_SHARE = 0.2  # that its progress shows
LONGEST_MS = 180_000  # until the diagnosis is so far
PAPER_MM, MARGIN_MM = (210, 297), 14  # A4; the margin of the report's style sheet
PIXELS_A_MM = 96 / 25.4  # of a page in a browser


def main() -> None:
    """Take the pictures that were asked for."""
    parser = argparse.ArgumentParser(prog="screenshots", description=__doc__.splitlines()[0])
    parser.add_argument("--report", type=Path, metavar="REPORT.html", help="a report to show")
    parser.add_argument("--page", metavar="URL", help="address of a live page")
    parser.add_argument("--out", type=Path, default=IMAGES, help="default: docs/images")
    arguments = parser.parse_args()
    if not arguments.report and not arguments.page:
        parser.error("expected --report or --page, found neither")
    if arguments.report and not arguments.report.is_file():
        parser.error(f"--report: expected a report, found no file {arguments.report}")
    arguments.out.mkdir(parents=True, exist_ok=True)
    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        if arguments.report:
            show_report(browser, arguments.report.resolve().as_uri(), arguments.out)
        if arguments.page:
            show_page(browser, arguments.page, arguments.out)
        browser.close()


def show_report(browser: Browser, url: str, folder: Path) -> None:
    """Take a report on a desktop, in the dark, on a phone and on paper."""
    for name, (viewport, scheme, part) in REPORT.items():
        page = open_page(browser, url, viewport, scheme)
        page.wait_for_selector("html[data-ready]")
        if part:
            page.locator(part).evaluate("part => part.scrollIntoView()")
        take(page, folder / f"{name}.png")
    width, height = (round(PIXELS_A_MM * (mm - 2 * MARGIN_MM)) for mm in PAPER_MM)
    page = open_page(browser, url, {"width": width, "height": height}, "light")
    page.emulate_media(media="print")
    paper = folder / "report_paper.png"
    page.screenshot(path=paper)
    page.close()
    ImageOps.expand(Image.open(paper), round(PIXELS_A_MM * MARGIN_MM), "white").save(paper)
    shrink(paper)


def show_page(browser: Browser, url: str, folder: Path) -> None:
    """Take the live page once both pendulums have moved for some seconds."""
    for name, (viewport, scheme) in PAGE.items():
        page = open_page(browser, url, viewport, scheme)
        page.wait_for_selector("#rig[data-state=fresh]")
        page.wait_for_timeout(8000)
        take(page, folder / f"{name}.png")
    page = open_page(browser, url, *PAGE["page"])
    page.wait_for_selector("#rig[data-state=fresh]")
    if page.locator("[data-button=record]").is_visible():
        show_diagnosis(page, folder / "page_diagnosis.png")


def show_diagnosis(page: Page, path: Path) -> None:
    """Make a recording on the live page, take its running diagnosis, and give that up."""
    page.click("[data-button=record]")
    page.wait_for_selector(f"{NEWEST}[data-stage=recording]")
    page.wait_for_timeout(RECORDED_MS)
    page.click("[data-button=end_recording]")
    page.wait_for_selector(f"{NEWEST}[data-stage=diagnosing], {NEWEST}[data-stage=kept]")
    if page.locator(NEWEST).get_attribute("data-stage") == "kept":
        print(f"{path}: left as it was: view_node without twin_file diagnoses nothing")
        return
    page.wait_for_function(
        "([row, share]) => document.querySelector(`${row} progress`).value >= share",
        arg=[NEWEST, DIAGNOSED_SHARE],
        timeout=LONGEST_MS,
    )
    page.screenshot(path=path)
    page.click(f"{NEWEST} button")
    page.wait_for_selector(f"{NEWEST}[data-stage=given_up]")
    page.close()
    shrink(path)


def open_page(browser: Browser, url: str, viewport: Any, scheme: Any) -> Page:
    """Open an address in a page of its own."""
    page = browser.new_page(viewport=viewport, color_scheme=scheme)
    page.goto(url)
    return page


def take(page: Page, path: Path) -> None:
    """Save what is in sight, small."""
    page.screenshot(path=path)
    page.close()
    shrink(path)


def shrink(path: Path) -> None:
    """Give a picture fewer colours, and print its path."""
    Image.open(path).convert("RGB").quantize(COLOURS).save(path, optimize=True)
    print(path)


if __name__ == "__main__":
    main()
