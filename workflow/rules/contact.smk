# What touches in the scenes: each contact, and what instruments that are moved would make a hand feel.

FELT = sources("collision", "scenes/motion", "evaluation/contact_force")


rule tabulate_contacts:
    input:
        motions=expand("results/data/scenes/{scene}/motion.h5", scene=TOUCHING),
        code=FELT,
    output:
        contacts="results/tables/contacts.csv",
        force="results/tables/contact_force.csv",
    log:
        "results/logs/tabulate_contacts.log",
    message:
        "tabulate what touches"
    script:
        "../scripts/tabulate_contacts.py"


rule draw_contact_force:
    input:
        force="results/tables/contact_force.csv",
        code=PICTURES,
    output:
        drawn("contact_force_{scene}"),
    log:
        "results/logs/scenes/{scene}/draw_contact_force.log",
    message:
        "draw what is felt in {wildcards.scene}"
    script:
        "../scripts/draw_contact_force.py"
